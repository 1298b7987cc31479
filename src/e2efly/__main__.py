"""`e2efly`, and `python -m e2efly`."""

from e2efly.flight.process import end_at_interrupt, open_streams


def main() -> None:
    """Run the command line. Ctrl-C ends it from here on, also during imports."""
    open_streams()
    end_at_interrupt()
    from e2efly.commands.cli import main

    main()


if __name__ == "__main__":
    main()
