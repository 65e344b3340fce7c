"""From bytes to arrays: file formats that know nothing of a trained system. All files are untrusted."""
