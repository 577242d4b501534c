"""Positioning systems as plug-ins: the contract, its conformance suite, one file per system."""
