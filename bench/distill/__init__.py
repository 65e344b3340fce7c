"""Distils the project's own avatars from their dumps, with their structure ignored, and prints what was reached."""
