"""The twelve films: who is in them, what they wear, the lens, the light and the length."""

from __future__ import annotations

from dataclasses import dataclass

SCAN = -1


@dataclass(frozen=True)
class Film:
    """One film. Two films that differ in one value alone say what that value costs."""

    name: str
    identity: int  # row of samples/data/film_heads.npz, or SCAN: the scanned head
    skin: str  # a name of skin.SKINS
    focal: float  # times the width of the image
    light: str  # a name of room.LIGHTS
    shirt: tuple[float, float, float]  # display-referred
    seconds: float = 10.0
    glasses: bool = False
    hair: tuple[float, float, float] | None = None  # its colour

    @property
    def seed(self) -> int:
        """Of motion, room and noise."""
        return 100 + [film.name for film in FILMS].index(self.name)


NAVY, GREY, GREEN, RED, WHITE, BLACK = (
    (0.13, 0.17, 0.30),
    (0.52, 0.53, 0.55),
    (0.22, 0.36, 0.27),
    (0.55, 0.16, 0.15),
    (0.84, 0.83, 0.80),
    (0.09, 0.09, 0.10),
)
BROWN, DARK, BLOND, SILVER, AUBURN = (
    (0.215, 0.150, 0.105),
    (0.075, 0.062, 0.060),
    (0.62, 0.48, 0.30),
    (0.55, 0.55, 0.56),
    (0.36, 0.17, 0.09),
)

FILMS: tuple[Film, ...] = (
    Film("anna", 0, "fair", 1.3, "front", NAVY, hair=BROWN),
    Film("bela", 1, "dark", 1.3, "side", WHITE),
    Film("carl", 2, "ruddy", 2.2, "front", GREEN, seconds=20, glasses=True),
    Film("dina", 3, "olive", 0.9, "side", GREY, hair=DARK),
    Film("emil", SCAN, "fair", 1.3, "side", BLACK, seconds=12),
    Film("fara", 4, "brown", 2.2, "side", RED, hair=DARK, glasses=True),
    Film("gian", 5, "olive", 1.3, "front", NAVY, seconds=30),
    Film("hana", SCAN, "light", 0.9, "front", WHITE, hair=DARK, seconds=12),
    Film("igor", 6, "ruddy", 1.3, "side", GREY, hair=SILVER, glasses=True),
    Film("joan", 7, "brown", 0.9, "front", GREEN),
    Film("kofi", 0, "dark", 2.2, "front", RED),
    Film("lena", 1, "light", 2.2, "side", BLACK, hair=AUBURN, seconds=15),
)


def film(name: str) -> Film:
    """The film of this name. ValueError for another name."""
    for one in FILMS:
        if one.name == name:
            return one
    raise ValueError(f"{name} is no film; there are {', '.join(one.name for one in FILMS)}")
