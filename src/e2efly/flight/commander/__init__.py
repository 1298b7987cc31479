"""Commands from outside: another program flies in place of a policy, and the bridge treats it like a policy."""
