"""Effects of settings: single changes, searches, proofs of causes, and the decisive ones of a fix."""
