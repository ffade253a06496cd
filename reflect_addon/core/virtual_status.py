"""What a search for a reflection point says of its vertex; estalella-2005 section 6.1 names the regions."""

CONVERGED = 1.0  # reflected: bisector and normal agree, eye and vertex are before the surface
HIDDEN = 2.0  # behind the reflector: found by the inverse search; its virtual vertex is the point whose image it is
UNREFLECTED = 3.0  # reflected by what closes an open reflector, which is not there
FAILED = 4.0  # nothing can be said of it

NAMES = {CONVERGED: "reflected", HIDDEN: "hidden", UNREFLECTED: "unreflected", FAILED: "failed"}
