"""Stress inside loaded gears and in their fillets."""
