"""Fly one policy file on several physics: the plants, the flights, and the task's own verdict on them."""
