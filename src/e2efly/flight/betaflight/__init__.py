"""The flight controller: its protocol, its settings, its sticks, its watchdog."""
