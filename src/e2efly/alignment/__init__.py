"""From what one can measure to a vehicle file: small estimators, one a source, and one fusion of what they say."""
