"""Freight derailments of every cause: what predicts how many cars, and how well."""
