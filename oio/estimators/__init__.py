"""Filters, one per file: immutable, belief in, belief out."""
