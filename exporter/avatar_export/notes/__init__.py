"""What a user should know of an avatar, as data, and the texts that are made of it: a table for each room."""

__all__ = ["note", "text"]
