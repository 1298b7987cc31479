"""Looking at runs and flights: plots."""
