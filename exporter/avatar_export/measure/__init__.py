"""One avatar measured against another, and what a player needs to show an avatar before it plays it."""
