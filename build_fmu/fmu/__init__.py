"""Puts an FMU together: description, pages, library, licences, archive."""
