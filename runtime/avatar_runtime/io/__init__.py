"""Files and the errors about them: opening, reading and writing whole files, and whose an error is."""
