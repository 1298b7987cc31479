"""The records of a flight, and how they are read again."""
