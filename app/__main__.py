"""Entry point of `python -m gearbench` and of the `gearbench` script."""

from gearbench.cli import main

if __name__ == "__main__":
    main()
