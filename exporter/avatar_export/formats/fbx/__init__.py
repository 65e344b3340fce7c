"""The content of .fbx files, read by ufbx in a separate process."""
