"""The parts of glTF files that rigs and clips need."""
