"""A bus beyond one machine: certificates, who may do what, and how much at most."""
