"""Scripts that run in processes, and Pythons, of their own: each needs Python 3.8 and the package it speaks for."""
