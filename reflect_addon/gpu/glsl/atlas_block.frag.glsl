// One billboard's block of the atlas from its captured level 0: every level inside a border that repeats its edge, as
// core/billboard_atlas.py lays them out. Sides are powers of two, so a coarser texel is the mean of whole texels below.
// block: x, y = the block's lowest left texel; z, w = width, height of level 0. more: x = levels, y = 1 / scale of radiance.

vec4 level_texel(ivec2 at, int level, ivec2 size)
{
  at = clamp(at, ivec2(0), (size >> level) - 1);
  int side = 1 << level;
  vec4 total = vec4(0.0);
  for (int y = 0; y < side; y++) {
    for (int x = 0; x < side; x++) {
      total += texelFetch(captured_tx, at * side + ivec2(x, y), 0);
    }
  }
  return total / float(side * side);
}

void main()
{
  ivec2 size = ivec2(block.zw);
  int levels = int(more.x);
  ivec2 at = ivec2(gl_FragCoord.xy) - ivec2(block.xy);
  vec4 texel = vec4(0.0);
  if (at.x < size.x + 2) {
    if (at.y < size.y + 2) {
      texel = level_texel(at - 1, 0, size);
    }
  }
  else {
    at.x -= size.x + 2;
    for (int level = 1; level < levels; level++) {
      ivec2 side = (size >> level) + 2;
      if (at.y < side.y) {
        if (at.x < side.x) {
          texel = level_texel(at - 1, level, size);
        }
        break;
      }
      at.y -= side.y;
    }
  }
  texel_out = vec4(clamp(texel.rgb * more.y, -65504.0, 65504.0), texel.a);
}
