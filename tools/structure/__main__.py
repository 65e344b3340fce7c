"""`python -m tools.structure` prints the figures and whatever lies beyond a limit."""

from __future__ import annotations

from tools.structure import (
    MOST_LINES,
    MOST_MODULES,
    file_circles,
    full_folders,
    long_files,
    players,
    room_circles,
    without_docstring,
)


def main() -> None:
    """Prints them."""
    bare = without_docstring()
    circles = {
        "rooms": room_circles(),
        "Python files": file_circles(),
        "files of TypeScript and C++": players.file_circles(),
        "namespaces of C#": players.namespace_circles(),
        "assemblies of C#": players.assembly_circles(),
    }
    for kind, found_circles in circles.items():
        print(f"circles of {kind}: {len(found_circles)}")
        for circle in found_circles:
            print(f"  {', '.join(circle)}")
    for language, room in (
        ("Python", (full_folders, long_files)),
        ("other", (players.full_folders, players.long_files)),
    ):
        for figures, limit in zip(room, (MOST_MODULES, MOST_LINES), strict=True):
            found = figures()
            most = next(iter(found))
            what = "files in the fullest folder" if limit == MOST_MODULES else "lines of the longest file"
            print(f"{what}, {language}: {found[most]} ({most}; limit {limit})")
            for name in (name for name, count in found.items() if count > limit):
                print(f"  beyond: {name} {found[name]}")
    print(f"public names without docstring: {len(bare)}")
    for name in bare:
        print(f"  no docstring: {name}")


if __name__ == "__main__":
    main()
