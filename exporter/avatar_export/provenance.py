"""Where an avatar comes from and what may be done with it, as the manifest says it."""

from __future__ import annotations

from dataclasses import replace

from avatar_runtime.avatar import Avatar


def with_rights(avatar: Avatar, licence: str | None, author: str | None, consent: str | None) -> Avatar:
    """`avatar` with licence, author and consent statement; what nobody stated is said to be so."""
    stated = {"licence": licence, "author": author, "consent": consent}
    return replace(avatar, provenance={**avatar.provenance, **stated})
