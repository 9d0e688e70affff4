"""What a setting does: switched alone, searched for, proven as a reason, decisive in a cure."""
