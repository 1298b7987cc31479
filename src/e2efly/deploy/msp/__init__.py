"""MSP, the protocol that Betaflight speaks: frames, messages, links, and a client that never blocks."""
