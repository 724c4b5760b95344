"""`python -m amontons` is the command `amontons`."""

import sys


def main() -> None:
    """Entry point of the command, which needs the packages of the extra `cli`."""
    try:
        from .cli import main as command
    except ModuleNotFoundError as error:
        package = (error.name or "").split(".")[0]
        if package not in ("rich", "typer"):
            raise
        sys.exit(f'amontons: the command needs {package}, which is missing: pip install "amontons[cli]"')
    command()


if __name__ == "__main__":
    main()
