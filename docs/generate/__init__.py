"""What writes the generated pages and the tables of figures: `make docs`, `make figures`."""
