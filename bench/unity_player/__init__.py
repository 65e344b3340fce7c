"""What a pose costs in the core of the Unity player."""
