"""Builds FMUs: XML, pages, library, licences, archive."""
