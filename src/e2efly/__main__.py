"""`python -m e2efly`."""

from e2efly.cli import main

main()
