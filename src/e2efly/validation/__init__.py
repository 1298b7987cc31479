"""One policy file flown on several physics: the plants, the flights, and the task's own verdict on them."""
