"""Periodic systems whose exact response is known."""
