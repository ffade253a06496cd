"""Every tolerance that a test uses, in one table, with its reason. Fix causes; do not loosen these."""

import numpy as np

# scene/raytrace.py: Cycles works in float32 and returns positions computed on the triangle; issue 2 asks for this.
HIT_POINT_OF_DIAGONAL = 1e-5
# NumPy against GLSL and nodes: float32 with other operation orders, half-float images identical on both sides.
KERNEL_RADIANCE_RELATIVE = 1e-3
KERNEL_DISTANCE_RELATIVE = 1e-4
# sample_blends/teapot_data.py, in Newell's units: the smallest triangle sits at the lid's tip; a collapsed one has 0.
TEAPOT_TRIANGLE_AREA = 1e-4
# ... and the other model is a triangle mesh of the same patches whose vertices lie off our triangles by our chords' sag.
TEAPOT_DISTANCE = 0.01
# Rays that pass within rounding of a triangle's edge or graze it: two tracers in float32 may call them differently.
RAYS_ON_EDGES = 5e-4
# Emission has no noise; what is left between an ordinary camera and our rays is the averaging of samples in float32.
EMISSION_RELATIVE = 1e-5
# Cycles' narrowest pixel filter still moves rays by 0.005 px, and issue 2's pictures need no better than 0.01.
CAMERA_PIXELS = 0.01
# core/look.py: (max, mean) display-encoded difference to OpenColorIO over 16 stops of greys and saturated colours.
# Standard is the same formula. A 64-step table rounds the bend where a channel leaves zero: three steps of 8 bits for
# one saturated colour in a thousand; 99 % are within 0.003.
LOOK_STANDARD = (2e-5, 3e-6)
LOOK_TABLE = (1.3e-2, 4e-4)
# gpu/raymap.py: float32 interpolation of positions and normals by the rasteriser.
RAY_MAP = 1e-5
# A sphere of 256 x 128 facets lies this far inside the true one: (half an edge)^2 / 2, seen at up to 77 degrees.
SPHERE_FACETS = 8e-4
# core/shading.py against a 32-sample Cycles render, over the whole sphere and per ring of cosines (0.14 and up): what is
# left is facets at grazing angles and the noise of picking between two lobes.
REFLECTANCE_MEAN = 5e-4
REFLECTANCE_RING = 2e-3
# The look's table on the GPU: half-float entries (5e-4) and the sampler's 8-bit weights between two of them.
LOOK_GPU = 3e-3
# A few roundings of float32, relative.
FLOAT32 = 1e-6
# Half floats have 11 bits: rounding is at most this, relative.
HALF = 2**-11
# Two bilinear look-ups on the two sides of a cube's edge, in texels squared: a bilinear filter errs by an eighth of the
# second derivatives along the face's plane, which are at most 2 for the function of tests/analytic.py.
CUBE_SEAM = 0.5
# The same and 2x2 means, against the function itself.
CUBE_SMOOTH = 0.75
# A direction that a kernel finds in float32, through a few products and one division; rooms are up to 60 times as long as
# their nearest wall is near, which magnifies the roundings of the ray's start. Radians.
KERNEL_DIRECTION = 1e-5
# core/box_fit.py on exact points: a side is a weighted median of coordinates on its wall, exact but for the turn, which
# is a mean of plane normals; both together, relative and in radians.
BOX_WALL = 5e-3
BOX_TURN = 2e-3
# A rim is the outermost of 30,000 random points on the walls: their spacing, relative.
BOX_RIM = 0.03
# The median of 6 x 32^2 texels against random directions: a texel's own variation of distance.
MEDIAN_SHARE = 0.01
# A flat quad's corners: vertices are float32 about the object's own origin, and its plane comes from their eigenvectors.
QUAD_TURN = 1e-5
# How near to a quad's edge, in half extents, float32 may call a ray the other way: a few roundings of the ray's place in
# the scene over the smallest quad's width (1/50 of the scene, seen at a slant).
QUAD_EDGE = 1e-3
# NumPy against GLSL on 10^5 rays: float32 decides differently on which texel a distance is read from, which quad is met or
# which wall is left at rays that pass within rounding of the edge between two. Each exception must be such a ray: ...
RAYS_ON_BRINKS = 2e-4
# ... moved and turned by no more than this (m and rad; the room is 6 m wide, a texel is 6e-2 rad) it gives that answer.
BRINK = 1e-5
# The same for nodes in Cycles, each of them on a brink too; their arithmetic is in another order.
RAYS_ON_NODE_BRINKS = 1e-3
# Issue 2, "a convex mirror under nothing but an HDR world": the issue's own numbers.
WORLD_FLIP = 0.03
WORLD_MEDIAN_RELATIVE = 0.01
# Cycles against Mitsuba along the same mirror rays: float32 normals and angles, some 1e-3 of a texel of the sharpest world.
WORLD_TWO_TRUTHS = 1e-3
# Issue 2, "a mirror off-centre in a box room": hit_p95 and its share of environment's; the issue's own numbers.
BOX_HIT_P95 = 0.005
BOX_HIT_SHARE = 0.1
# Issue 2, "flat pictures around a mirror": hit_p95, and rmse as a share of environment's; the issue's own numbers.
BILLBOARDS_HIT_P95 = 0.005
BILLBOARDS_RMSE = 0.25
# scene/eevee_draw.py under a white world: EEVEE's screen tracing stores radiance as packed small floats (1.5 % at worst) ...
PEER_FURNACE = 0.03
# ... and its pixels are the ray map's, but for rays that pass close to another ball, which it takes for hits (1.7 %).
PEER_PIXELS = 0.03
# popescu-2006 5.2, relative z error of the bunny by points per row: the paper's own figures, held over the depth range.
SRDM_BUNNY = {8: 0.0143, 10: 0.009, 12: 0.007, 14: 0.005, 16: 0.004}
# Depth maps in float32 against float64: rays within rounding of another row, turn or the object's outline. A map has 64 to
# 256 rows of 3e-2 texels of rounding at most (SHORTEST's guard apart), each ray crosses one.
DEPTH_BRINKS = 5e-3
# gpu/capture.py: a rasteriser and a ray may call a texel whose centre is on the contour differently; none other.
CAPTURE_CONTOUR = 5e-3
# ... (median, 95 %) relative: what surfaces were refined to (2 %), plus at the rim what lies between a texel and its
# neighbours on a surface that turns away.
CAPTURE_RADIANCE = (0.01, 0.03)
# core/srdm.py: sines in steps of 2^-19 put a corner of the largest map (724 texels from the middle) this far off, texels:
# half a step in each of sine and cosine.
SRDM_SAMPLE = 1e-3
# core/second_order.py, a ball seen in a ball 0.3 to 2 m away, share of the first-order picture's error: what is left are
# edges of tiles, rays that miss the quad but not the ball, and the first ball's image in the second (third order).
SECOND_ORDER_RMSE = 0.8
SECOND_ORDER_MEDIAN = 0.1
# A flat mirror before a picture with a gradient of 0.1 per metre: texels of 3 cm, half-float colours.
FLAT_MIRROR = 3e-3
# core/ground_box.py on a ground that goes on: rmse and median hit error as shares of the environment map's. What is left
# of the first is the checks' edges, a texel wide in either; of the second the terrain's bumps.
GROUND_RMSE = 0.25
GROUND_HIT = 0.01
# Issue 3, `contact`: hit_p50 with one map an object; hit_p95 and missed + false with several; the issue's own numbers.
CONTACT_HIT_P50 = 0.003
CONTACT_HIT_P95 = 0.01
CONTACT_LOST = 0.02
# A rough floor's picture of a leg beside Cycles', row by row: 64 rays of the lobe a pixel, 256 paths, 64 pixels across.
ROUGH_WIDTH, ROUGH_LIGHT = 0.08, 0.05
# evaluation/stability.py: rays that float32 and float64 send to different places. Of those that graze a plane by 1e-7 m or
# pass exactly through a depth camera's eye one in fifty is decided by the last bit; of others one in thousands.
STABILITY_OTHER = 0.03
# ... and how far, in float32 steps of the largest coordinate, the others' places differ: some ten operations' roundings.
STABILITY_ULPS = 20
# core/lobe.py against a sum over 90,000 directions, share of the brightest of 40 lamps seen from up to 74 degrees, by
# the lamp's half side at a distance of 2: Fresnel, shadowing and measure are taken at one point of the lamp, and the
# slopes of a straight edge are not straight.
LOBE_MEDIAN = {0.01: 0.001, 0.1: 0.003, 0.3: 0.01, 1.0: 0.03}
LOBE_WORST = {0.01: 0.005, 0.1: 0.03, 0.3: 0.06, 1.0: 0.25}
# Half width of a highlight: Fresnel's, shadowing's and the measure's cosines change by 2 % over the widest (6 degrees).
HIGHLIGHT_WIDTH = 0.03
# core/view_dependent.py, a plane seen in a mirror: a ray's highlight against the sum over the lamp, of the brightest
# ray; half floats.
HIGHLIGHT = 0.02
# Issue 3, shading at the hit against Cycles: RMSE of rays that meet the glossy ball, as a share of the captured picture's.
GLOSSY_RMSE = 0.3
CONTACT_RMSE = 0.2  # of `environment`'s: the issue's fifth
# Of the sample itself the fifth is not held from every view: 0.17 at 160 x 120, 0.33 at the test's size, 0.29 to 0.40
# from three others. Each ray that meets a lamp by way of two parts of the mirror, or wrongly does not, adds 0.16 to 0.26 alone.
CONTACT_SELF_RMSE = 0.4
# Two mirror balls grown together, maps of 128 texels: share of hits one to eight texels away that are found within a quarter
# of a texel (0.943 measured; 0.870 by the rows alone).
NEAR_FOUND = 0.93
# Share of rays that leave the mirror for the sky but are said to meet it at their start (0.003 measured; 0.014 by the rows).
FALSE_STARTS = 0.006
# Radiance in a smooth sky after two or three mirrors: median error (0.0003 and 0.0008 measured).
THIRD_ORDER_MEDIAN = 0.003
# Light fields. What texels hold that were not traced: any share of it shows.
FAR_TOO_BRIGHT = 1e6
# Off 1 in an atlas of ones (4e-6 measured: weights are float32); a texel that was not traced and read would add 1e6 of its weight.
LIGHT_FIELD_ONE = 1e-3
# A ray that a view holds, off its texel: float32's rounding of its place, 1e-5 of a texel, times what neighbours differ by.
LIGHT_FIELD_TEXEL = 1e-3
# A painted ball of four cells' size: error with depths over that with the focal plane at the sky (0.38 to 0.59 measured).
LIGHT_FIELD_DEPTH_RMSE = 0.7
# Its hits, over its radius: a texel's depth is that of its middle, and a texel is 5 degrees wide (0.012 to 0.016 measured); and how
# much worse than from the best focal plane a picture may be.
LIGHT_FIELD_DEPTH_HIT = 0.03
# Errors of equal scenes 1e-3 to 1e4 m wide differ by float32's rounding alone.
LIGHT_FIELD_SIZES = 1e-2
# Depth of a wall over that of the focal plane found: a candidate's step is 1/49 (equal, as the wall's own depth is a candidate).
FOCUS = 0.03
# Slabs that a ray asks on average, directions spread evenly: the bands beside the seams hold a tenth of them.
SLABS_PER_RAY = 1.15
# How much an answer may change over a band beside a seam, where slabs differ by 1 and up to three of them meet.
SEAM_SLOPE = 4.0

# Block-compressed images. A grey ramp of four values: its ends are off by half a step of red and blue at most (0.0065 measured).
BC1_RAMP = 0.5 / 31 + 1e-6
# dB of the picture of tests/core/test_bc1.py (40.3 measured; its noise of 0.01, if it were lost, is 40 by itself).
BC1_PSNR = 40.0
# Median relative error of radiance behind hdr_code with a sun of 7e4: 21 stops in 31 and 63 steps, thirds in between (0.049 measured).
BC1_HDR_MEDIAN = 0.08
# hdr_code back and forth: float32's rounding of e, 6e-8, times 28 stops, times ln 2.
HDR_CODE = 5e-6
# A texel of BC1 on a GPU: Mesa's rounds both colours to 8 bits and cuts the thirds between them (0.0060 measured).
BC1_TEXEL = 2 / 255
# RMSE of a light field over an environment map's: the third with depths, half without.
LIGHT_FIELD_OF_ENVIRONMENT = {True: 1 / 3, False: 1 / 2}
# Median error of a compressed light field over the mean radiance: 5:6:5 bits of a code of few stops (0.0087 measured).
BC1_LIGHT_FIELD = 0.015
# A background's pixel on the GPU against NumPy: half floats of radiances below 1, and the rounding of the ray's direction by
# float32 matrices, which a painted texel's slope multiplies; and the share of values on the brink between two views' depths.
BACKGROUND_RADIANCE = 5e-3
BACKGROUND_SHARE = 2e-3
# A chequered room's picture from 8 x 8 views of 64 texels over one from an environment map at the mirror, with depths (0.42 measured,
# 0.32 with 128 texels: edges between texels are what is left) and without (0.61: the room is near, one plane serves it badly).
BACKGROUND_RMSE = {True: 0.5, False: 0.7}
# Issue 4 on `columns`, as a share of the RMSE of an `environment` that is baked anew at each frame: asked are a half for one focal
# plane at 32 x 32 views and a third with depths at 8 x 8; here 6 x 6 of 64 texels (0.28 and 0.28 measured at the worst frame).
LIGHT_FIELD_COLUMNS = 0.5
LIGHT_FIELD_COLUMNS_DEPTH = 1 / 3
# Two random rooms, so few texels for a lamp's edge that depths help little (0.43 measured, 0.40 with depths).
LIGHT_FIELD_ROOM = 0.5
# RMSE over that of each slab's best focal plane of a scan (target Y6; 0.995 measured), and over that without disparity.
LIGHT_FIELD_FOCUS = 1.05
LIGHT_FIELD_FOCUS_SKY = 0.8
# Second differences in time over the truth's own (0.84 measured).
LIGHT_FIELD_FLICKER = 2.0
# gpu/virtual*.py against Embree, shares of reflector pixels: pixels on outlines, a pixel wide around a thing 20 pixels wide ...
VIRTUAL_MISSED = 0.01
VIRTUAL_FALSE = 0.005
# ... places of what is drawn, over the scene's diagonal: each pixel's own ray meets the triangle, in float32 ...
VIRTUAL_PLACE = 1e-4
# ... and interpolated between vertices that are a tenth of a radian apart.
VIRTUAL_BETWEEN = 5e-3
# ... searches around a ball that find nothing: vertices at its silhouette, within float32.
VIRTUAL_FAILED = 0.005
# A mirror in a mirror, RMSE over that of its own light alone: from distance maps of 32 texels a face, without third order.
VIRTUAL_SECOND_ORDER = 0.3

# Reflector parts (issue 5). A point of the surface is given back when the ray to it from a part's centre ends within this share of
# the reflector's size (rounding ends at 1e-9; 1e-3 is a neighbour across a fold) and the normal there is this near, radians.
PART_PLACE, PART_NORMAL = 1e-3, np.radians(1)
# ... and share of random surface points that are: the 0.99 and, 0.95 for meshes with folds that no 16 points see all of.
PART_COVER = {"formula": 0.99, "model": 0.95}
# Share of area whose kind is the formula's: what is left are triangles across the border between kinds, and poles.
KIND_SHARE = 0.97
# core/part_surface.py against Embree's triangle and its plane in float64, share of the size: rays that pass within float32's rounding
# of an edge between two triangles may take the other, whose plane is off by the fold there.
PART_RAY, PART_RAYS_ON_EDGES = 1e-9, 1e-3
# A map's worth of directions against a part of thousands of triangles, seconds of processor (0.5 measured).
PART_SECONDS = 4.0

# Reflection points in reflector maps (issue 5): the distance from the true one, sizes of the reflector, and the share that is as near;
# both are the issue's. Points nearer than three texels to an open rim are left out: a rim is known to a texel.
POINT, POINTS_FOUND = 1e-4, 0.999
# A virtual vertex is off by twice the vertex's height times the normal's error, over the vertex's distance.
VIRTUAL_POINT = 3e-4
# The order in which errors fall with the resolution: bilinear look-ups, 2.
SEARCH_ORDER = (1.8, 2.2)
# Shares of hidden vertices that are found to be; 1 where a reflector is not named. A needle's tips are a few texels of its map.
HIDDEN_FOUND = {"ellipsoid 5:1": 0.995, "ellipsoid 10:1": 0.99, "ellipsoid 50:1": 0.97}
# A hidden vertex against the image of what it is the image of, sizes: two searches in maps of 256 texels a face.
HIDDEN_IMAGE = 1e-3
# A virtual vertex's step over the square root of its vertex's, across the limit: a line of sight enters a surface that it grazes at the
# square root of its depth (3.7 measured), and steps on both sides of the limit end there.
VIRTUAL_JUMP = 6.0
# Share of vertices reflected within 0.3 sizes beyond a rim that are said to be: a plane's closing is the plane, a bent surface's is
# a mean of tangent planes in which most searches fail.
UNREFLECTED_FOUND = {"plane": 0.9, "paraboloid": 0.0}
# The search on the GPU against NumPy: share of equal statuses, and the distance of points where they are, sizes.
SEARCH_STATUS_GPU, SEARCH_POINT_GPU = 0.999, 1e-5
# A look-up in a map of 64 texels a face, largest error: an eighth of a texel's square, 1.2e-4, times the curvature over directions, which
# is 1 on a sphere and some twenty at the ends of the ellipsoid and where rays graze the paraboloid; (point, normal).
MAP_ERROR = (4e-3, 4e-3)
# Grids on the GPU against NumPy: share of equal statuses (0.9992 measured), and of points at most so many pixels apart (0.999). Where
# rounding decides whether a cell is taken apart its vertices differ by up to the tolerance; near the silhouette points are far away.
GRID_STATUS_GPU, GRID_PIXELS_GPU = 0.995, 5e-2
# ... and the counts of searches, besides those for what shares a block with what is shown: the same roundings.
GRID_SEARCHES_GPU = 0.02
# Share of the drawn pixels that show another place than with all vertices searched (0.04 measured to a quarter of a pixel; 0.24 by share,
# where a torus of 2000 vertices has 200 nodes): edges of triangles, beside which a pixel shows what is next to it ...
GRID_DRAWN = {"levels": 0.06, "share": 0.3}
# ... of the reflector pixels where Embree finds something and nothing is drawn (0.03 measured by share) ...
GRID_MISSED = 0.04
# ... and the 95th percentile of places, over the scene's diagonal (1e-3 measured by share, 1e-4 in levels).
GRID_PLACE = 2e-3
# core/virtual_grid.py. Nodes against the share asked for: whole cells, as near to cubes as may be, so counts come in steps of about
# a layer of cells (0.09 measured).
GRID_SHARE = 0.3
# 95th percentile of the displacement of interpolated vertices, px at 320 x 240: target E3 ("not noticeable"; at most 0.20 measured).
GRID_DISPLACEMENT = 0.5
# Share of the reflected vertices that are interpolated: the others are beside the silhouette or a failed node.
GRID_SEEN = 0.9
# A hundred thousand vertices' tables of both kinds, seconds of processor (0.28 to 0.38 measured).
GRID_SECONDS = 2.0
# RMS error of radiance after cutting along its steps over that before, edges of 1/32 of a floor's side and four halvings: two in 16
# of the jump's band are left, hence a third of its RMS, and where borders cross the middle of a triangle (0.17 to 0.36 measured).
CUT_ERROR = 0.4
# A texel's radiance that no step is near: float32.
CUT_RADIANCE = 1e-6
# RMS error of a chequered floor of 0.2 and 1 by the solid angle at a ball, edges of 1/32 rad with four halvings (0.07 measured).
REACH_RADIANCE = 0.1

# core/virtual_follow.py: how much more than their places virtual points jump that are a thousandth apart, px at a tolerance of 1
# (0.034 measured).
GRID_JUMP = 0.05
# ... and the largest error over the tolerance where a bump bends up along one axis and down along another, which cancel at a cell's
# middle (2.4 measured; in mirrors the largest is below the tolerance).
GRID_SADDLE = 3.0
# core/virtual_mesh.py: how much more than by the second derivative an edge bends that is 0.2 rad wide (1.02 measured).
CHORD_HIGHER_ORDERS = 1.05
# Share of a small picture's pixels that show virtual objects, largest difference between scales: float32 decides differently at a
# silhouette's pixels (5e-3 measured where a wall is a million units off).
SCALE_DRAWN = 0.02

# core/mirrored_view.py in float64: px of points whose clip w may be a hundredth of their distance (1e-10 measured) ...
MIRRORED_PIXEL = 1e-6
# ... entries of poses and clip matrices about 5 from the origin, mirrored twice ...
MIRRORED_POSE = 1e-12
FRONTAL_PIXEL = 0.05  # a pixel's size of a frontal view, found at corners of what is seen and there at a tenth of the way to the middle
# ... and a far distance found again after eight mirrors, relative: each solves the leaning plane once (1e-13 measured).
MIRRORED_DEPTH = 1e-9
# core/mirror_planes.py: meshes are float32 about their own origin, relative to their size (4e-8 to 2e-7 measured).
PLANE_FIT = 1e-6
# core/mirror_outline.py: px^2 of an area counted on a grid of 0.1 px, whose border of up to 200 px is half a cell off (0.9 measured).
CLIPPED_AREA = 2.0
# core/tree_growth.py: share of 120 x 90 pixels counted by rays through their centres: half of a border of up to 200 px at a time is off
# by chance, a few pixels in all (4e-4 measured).
SHARE_COUNTED = 1e-3

# Mirrored views. Share of pixels beside an edge: the rasteriser and Embree cut a pixel's middle from another side.
RECURSIVE_EDGE = 0.01
# Of the scene's diagonal, 99 of 100 pixels: float32 places of rays and surfaces, some metres from the origin.
RECURSIVE_PLACE = 1e-5
# Surface radiance is refined to 2 % of differences of about 0.3; half of all pixels are nearer.
RECURSIVE_RADIANCE = 0.02
# Of a picture's mean radiance, which is about 0.3: what is culled as faint or small is below 1e-4 of its light each, and distance maps stand in for it.
RECURSIVE_CULLED = 1e-3

# Rough planar mirrors. An even world's surface radiance and distance maps are half floats (2e-4 measured).
GLOSSY_EVEN = 1e-3
# Mean error of radiance from 0.05 to 1 beside a leg: 64 rays with 2 % of their own noise, and what the view does not see.
GLOSSY_MEAN = 0.03
# core/mirror_march.py: share of found rays that meet the wrong thing: a strip without thickness counts as four pixels thick, 0.4 m there (0.056
# measured) ...
MARCHED_WRONG = 0.07
# ... and distance along the ray, relative, median: half a pixel across at a grazing ray's end (2e-3 measured).
MARCHED_DISTANCE = 0.01
# core/curved_march.py in a room of flat walls, a view of 96 px: share of rays that are found and meet nothing in the picture, or the other way round, a
# pixel from its edge (5e-3 measured) ...
CURVED_FOUND = 0.015
# ... distance along the ray, relative, median: a quarter of a pixel of 2.4 degrees in the middle (4e-3 measured) ...
CURVED_DISTANCE = 0.01
# ... and a colour of 0.1 to 0.9 between four such pixels (1.2e-3 measured).
CURVED_COLOUR = 0.005
# Drawn in 160x120 px, median errors: radiance of 0.1 to 1 where the view shows something (0.002 measured), places in m (0.004) ...
CURVED_DRAWN, CURVED_PLACE = 0.02, 0.02
# ... radiance by way of a small ball, a pane and a ball, some pixels in a view of some 50 (0.063 measured, of 16 px; 0.14 of a ball of 0.35 m,
# whose surface sees another image in the pane than its middle does) ...
CURVED_DEEP = 0.1
# ... and light of 2 to 9 of a lamp, added to half floats.
CURVED_LAMP = 0.02
# Rays of a pixel: radiance of at most 1 in half floats (2.4e-4), and stripes of 16 a unit at float32 directions that are normalised by another way (1e-5) ...
PIXEL_RAYS = 1e-3
# ... of all but pixels where one of two nearly equal differences, or a count at its step, falls the other way ...
PIXEL_RAYS_ALIKE = 0.99
# ... and error against 64 rays a pixel, over that of one ray (0.42 measured).
PIXEL_RAYS_ERROR = 0.5
# Live cube maps. Relative error of distances in half floats, 11 bits, and of a float32 place some metres away (5e-4 and 1e-6) ...
MAP_DISTANCE = 2e-3
# ... share of texels beside an edge, faces of 32: the rasteriser and Embree cut a texel's middle from another side; surfaces that are refined
# are not those that are traced (0.006 measured) ...
MAP_EDGE = 0.03
# ... a mean of up to 64 half floats of about 1, rounded once or at every level ...
MAP_HALF = 4e-3
# ... and radiance of two ways to the same place, 99 of 100 pixels: what is expected to be wrong by 1e-3 of a map's light is left, and halves.
MAP_SETTLED = 1e-2
# ... and the median error where something is met, over that of look-ups by direction alone (0.79 measured; of it surface radiance is a half).
MAP_PLACED = 0.9
# Calmed surfaces (core/surface_calm.py): the noise that is left over the one wished for, and questions over those that theory asks: variances
# of three answers, averaged over some twenty neighbours, are uncertain by a sixth, and samples are asked a whole number of times.
CALMED_NOISE = 0.2
CALMED_QUESTIONS = 0.25
# ... a ball's normal where a ray from a dozen radii away meets it, all but grazing, in float32 (1.1e-4 measured) ...
BALL_NORMAL = 5e-4
# ... and the RMSE of what planar mirrors show to rays that are mirrored where these are, over that of a march through their images
# (0.03 measured).
MAP_MIRRORED = 0.1
# Rough mirrors, a lobe of one or two pixels: RMSE at edges against GGX by Monte Carlo of a view with several pixels for each of the picture's, over that
# of one with as many (0.54 measured; the view's surfaces and 64 rays are a part of both).
GLOSSY_FINER = 0.7

# Mirrors beyond the last level: difference to a picture five levels deeper over that of distance maps (measured: see docs/decisions.md), of which
# single pixels beside outlines are all.
SERIES_OVER_MAPS = 0.5
# gpu/viewport_views.py: hues of flat colours, half floats twice and a blend of neighbours ...
VIEWPORT_COLOR = 0.02
# ... share of pixels at the edges of things, in pictures of 128 x 96 with a mirror in a mirror (0.067 measured) ...
VIEWPORT_EDGE = 0.12
# ... and the same where the picture was drawn from 5 cm beside (0.071 measured).
VIEWPORT_LATE = 0.2
# Coarser meshes in deep levels: mean difference of radiance from 0.1 to 1, over a picture of which a few hundredths are such levels.
COARSE_PICTURE = 2e-3

# Glass (core/glass_optics.py). Sums of a slab's series in float32.
GLASS_SERIES = 1e-4
# Share of rays that leave a body elsewhere than the book says: those that pass within a texel of an edge, once for each face they meet.
GLASS_EDGES = 0.03
# Of the share that is left out: 1024 rays of a spread of 0.15.
GLASS_LEFT = 0.015
# Mean error of radiance of 0.2 to 1 seen through a pane: surface radiance between its vertices, as in mirrors.
GLASS_PANE = 0.02
# Seen through a body, where distance maps answer the rays that leave: a magnified wall is off by more than a mirrored one.
GLASS_BODY = 0.06

# reflect-three in a browser against `render`, FLIP over the reflectors' pixels: a browser knows how a surface stretches a pixel from the pixel's own triangle, `render`
# from both neighbours, so strongly curved spots are blurred along another line (0.026 to 0.035 measured in contact at 320 x 240, 0.049 in teapots) ...
WEB_FLIP = 0.05
# ... and beside the reflectors, where half floats and the look are all there is (0.0028 measured).
WEB_BESIDE = 0.005
# The same scene moved, turned and made larger as a whole: the browser's own picture again, but for numbers rounded elsewhere (0.0008 measured).
WEB_MOVED = 0.005

# An export's look table holds half floats: half a unit in the last place of numbers below 1.
EXPORT_LOOK = 2.0**-12
# Share of rays that meet an edge of a map of 8 texels a side, where two programs' roundings pick different texels (found: none).
EXPORT_COARSE_BRINKS = 5e-4

# reflect-godot against `render` as reflect-three is, FLIP over the reflectors' pixels (0.026 to 0.033 measured in contact) and beside them (0.0018).
GODOT_FLIP = 0.05
GODOT_BESIDE = 0.005
