"""An avatar and its player put into the project of an engine."""
