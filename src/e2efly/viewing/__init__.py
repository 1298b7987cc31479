"""Looking at runs and flights: plots, reports, the live page, and the page in which a policy flies."""
