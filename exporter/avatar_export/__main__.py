"""`avatar-export`, and `python -m avatar_export`."""

from avatar_export.commands.memory import EXPORT
from avatar_export.commands.process import start


def main() -> None:
    """Entry point."""
    start("avatar-export", "avatar_export.cli", EXPORT)


if __name__ == "__main__":
    main()
