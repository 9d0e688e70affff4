"""What judges a run: its audit, from the model and the record alone (`audit`), and how far it is off (`truth`)."""
