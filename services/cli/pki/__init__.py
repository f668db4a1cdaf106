"""`rhot pki`: the rig's own certificate authority, and a certificate for each of its hosts."""
