// A cell of a grid and its eight corners: trilinear interpolation (core/virtual_grid.py), what failed filled up by the others.
// cells_buf: three texels a cell: corners 0 to 3, corners 4 to 7, then the middle and the cell above, -1 where there is none.
// NODE(texel): a node's virtual point, w = status; NODE_START(texel): the direction to where it is reflected, w > 0.5 where known.

struct Cell {
  vec4 low, high;  // its corners' numbers
};

struct Interpolated {
  vec4 virtual_P;  // w the best status among the corners
  bool broken;     // interpolation has no meaning: a corner failed, or reflected ones lie beside hidden ones
  bool hidden;     // all corners are
};

Cell cell_at(int cell)
{
  return Cell(texelFetch(cells_buf, texel_of(3 * cell), 0), texelFetch(cells_buf, texel_of(3 * cell + 1), 0));
}

ivec2 corner_of(Cell cell, int corner)
{
  return texel_of(int(((corner < 4) ? cell.low[corner] : cell.high[corner - 4]) + 0.5));
}

float weight_of(vec3 where, int corner)
{
  vec3 share = mix(1.0 - where, where, vec3(corner & 1, (corner >> 1) & 1, corner >> 2));
  return share.x * share.y * share.z;
}

Interpolated interpolated(Cell cell, vec3 where)
{
  vec3 sum = vec3(0.0), mean = vec3(0.0);
  float lost = 0.0, count = 0.0, best = FAILED, worst = 0.0;
  bool reflected = false, hidden = false;
  for (int corner = 0; corner < 8; corner++) {
    float weight = weight_of(where, corner);
    vec4 found = NODE(corner_of(cell, corner));
    float is_found = float(found.w < FAILED - 0.5);
    lost += weight * (1.0 - is_found);
    sum += weight * is_found * found.xyz;
    mean += is_found * found.xyz;
    count += is_found;
    best = min(best, found.w);
    worst = max(worst, found.w);
    reflected = reflected || found.w < CONVERGED + 0.5;
    hidden = hidden || abs(found.w - HIDDEN) < 0.5;
  }
  bool broken = count < 7.5 || (reflected && hidden);
  return Interpolated(
      vec4(sum + lost * mean / max(count, 1.0), best), broken, best > HIDDEN - 0.5 && worst < HIDDEN + 0.5);
}

// From where a search in the cell begins: what its corners found, where any did.
vec4 start_in(Cell cell, vec3 where)
{
  vec4 sum = vec4(0.0);
  for (int corner = 0; corner < 8; corner++) {
    vec4 start = NODE_START(corner_of(cell, corner));
    // Where the only ones that are known weigh nothing, they say it.
    sum += (weight_of(where, corner) + 1e-4) * float(start.w > 0.5) * vec4(start.xyz, 1.0);
  }
  return vec4(sum.xyz, float(sum.w > 0.0));
}

#ifdef LISTS
// list_img: what is to be searched; count_img: how many, of each pass that makes a list (range.z).
void put_on_list(int point)
{
  imageStore(list_img, texel_of(int(imageAtomicAdd(count_img, texel_of(int(range.z)), 1u))), uvec4(point));
}
#endif
