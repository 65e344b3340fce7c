"""Players put together: hand-written files, texts of shaders and tables as one folder that an engine takes."""
