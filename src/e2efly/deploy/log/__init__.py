"""What is kept of a flight, and how it is read again."""
