// The depths around each corner of a depth map's texels, as core/depth_refine.py's corners_of lays them out: lower left,
// lower right, upper left, upper right. block: xy = the block's lowest left texel, z = side of the map in texels.

float depth_of(ivec2 at, int side)
{
  bool inside = all(greaterThanEqual(at, ivec2(0))) && all(lessThan(at, ivec2(side)));
  return inside ? texelFetch(map_depth_tx, at, 0).x : BACKGROUND;
}

void main()
{
  ivec2 at = ivec2(gl_FragCoord.xy) - ivec2(block.xy);
  int side = int(block.z);
  corners_out = vec4(depth_of(at - 1, side), depth_of(at + ivec2(0, -1), side), depth_of(at + ivec2(-1, 0), side),
                     depth_of(at, side));
}
