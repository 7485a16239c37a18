"""What models cannot represent and cases cannot ask for, found before work begins."""
