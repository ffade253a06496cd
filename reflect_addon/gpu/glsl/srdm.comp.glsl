// Simplified rotated depth maps, a turned row per invocation: core/srdm.py and srdm_greedy.py, number by number.
//
// map: x = side w of the depth map, y = turns n, z = points m. places: xy = the map's first texel in depth_img, zw = the
// table's in table_img. depth_img: q, below zero for background (an image because software OpenGL reads it three times as
// fast as a sampler). turns_buf: texel i = cosine and sine of turn i in steps of 2^-TURN_BITS. SLOTS >= m - 1, a multiple
// of four, sizes what an invocation keeps to itself. All decisions are in whole numbers.

const uint PLACE = 1023u;  // ten bits: a sample, or a slot

ivec2 first_sample;  // of the row, and from one sample to the next; in parts of a texel
ivec2 next_sample;
uint segments[SLOTS];  // first sample | last sample << 10 | slot of the segment to the right << 20
uint priorities[SLOTS];  // error << 10 | the worst sample counted from the right; 0 needs no split

// Depth of the row's sample k, which lies inside the map (an image answers 0 elsewhere, for what is not used).
float depth_at(int k)
{
  return imageLoad(depth_img, ivec2(places.xy) + ((first_sample + k * next_sample) >> (TURN_BITS + 1))).x;
}

int steps_at(int k)
{
  return int(clamp(depth_at(k) * float(STEPS), 0.0, float(STEPS - 1)));
}

int first_of(uint segment)
{
  return int(segment & PLACE);
}

int last_of(uint segment)
{
  return int((segment >> 10u) & PLACE);
}

// Of the segment from sample a to sample b: its largest error and where that is first.
uint priority_of(int a, int b)
{
  int span = b - a;
  int start = steps_at(a), rise = steps_at(b) - start;
  int risen = 0, largest = 0, worst = a;
  for (int k = a + 1; k < b; ++k) {
    risen += rise;
    int off = abs((steps_at(k) - start) * span - risen);
    if (off > largest) {
      largest = off;
      worst = k;
    }
  }
  if (largest == 0) {
    return 0u;
  }
  uint error = (uint(largest) * uint(PARTS) + uint(span - 1)) / uint(span);
  return (error << 10u) | (PLACE - uint(worst));
}

// Keeps the span a..b; of more than `most` the longest, the left ones on a tie. Returns how many are kept.
int keep_span(int a, int b, int kept, int most)
{
  uint span = uint(a) | (uint(b) << 10u);
  if (kept < most) {
    segments[kept] = span;
    return kept + 1;
  }
  int victim = 0, shortest = int(PLACE);
  for (int s = 0; s < most; ++s) {
    int size = last_of(segments[s]) - first_of(segments[s]);
    if (size <= shortest) {
      shortest = size;
      victim = s;
    }
  }
  if (b - a > shortest) {
    for (int s = victim + 1; s < most; ++s) {
      segments[s - 1] = segments[s];
    }
    segments[most - 1] = span;
  }
  return kept;
}

// Whether the row's sample k shows something; beyond the row and outside the map nothing does.
bool is_solid(int k, int side)
{
  ivec2 texel = (first_sample + k * next_sample) >> (TURN_BITS + 1);
  bool inside = uint(texel.x) < uint(side) && uint(texel.y) < uint(side) && k < side;
  return inside && imageLoad(depth_img, ivec2(places.xy) + texel).x >= 0.0;
}

// Walks the row and keeps its spans in the first slots. Returns how many.
int find_spans(int side, int most)
{
  int kept = 0, begun = -1;
  uint before = 0u;
  // One sample more than there are: the last span ends there. What happens once a span stays out of the walk: software
  // OpenGL computes both sides of every `if`.
  for (int start = 0; start <= side; start += 32) {
    uint solid = 0u;
    for (int i = 0; i < 32; ++i) {
      solid |= uint(is_solid(start + i, side)) << uint(i);
    }
    uint edges = solid ^ ((solid << 1u) | before);
    before = solid >> 31u;
    while (edges != 0u) {
      int k = start + findLSB(edges);
      edges &= edges - 1u;
      if (begun < 0) {
        begun = k;
      }
      else {
        kept = keep_span(begun, k - 1, kept, most);
        begun = -1;
      }
    }
  }
  return kept;
}

// Splits the worst segment where it is worst until m points are used. Returns how many segments there are.
int split(int spans, int m)
{
  int used = spans;
  for (int s = 0; s < SLOTS; ++s) {
    priorities[s] = 0u;
  }
  for (int s = 0; s < spans; ++s) {
    priorities[s] = priority_of(first_of(segments[s]), last_of(segments[s]));
    segments[s] |= uint(s + 1) << 20u;
  }
  for (int points = 2 * spans; points < m; ++points) {
    uint largest = 0u;
    int slot = 0;
    // Four slots at once; no two segments have the same priority, since no two have the same worst sample.
    for (int s = 0; s < used; s += 4) {
      uint four = max(max(priorities[s], priorities[s + 1]), max(priorities[s + 2], priorities[s + 3]));
      if (four > largest) {
        largest = four;
        slot = s;
      }
    }
    if (largest == 0u) {
      break;
    }
    while (priorities[slot] != largest) {
      ++slot;
    }
    uint old = segments[slot];
    uint middle = PLACE - (largest & PLACE);
    segments[slot] = (old & PLACE) | (middle << 10u) | (uint(used) << 20u);
    segments[used] = middle | (old & ~PLACE);
    priorities[slot] = priority_of(first_of(old), int(middle));
    priorities[used] = priority_of(int(middle), last_of(old));
    ++used;
  }
  return used;
}

// Writes the poly-lines from left to right, two points a texel, and fills up with unused ones.
void write(int used, int m, ivec2 corner)
{
  int slot = 0, left = used, last = -1;  // last: of the segment before
  bool ending = false;  // whether that segment's last point is one of its own
  for (int c = 0; 2 * c < m; ++c) {
    vec2 points[2];
    for (int i = 0; i < 2; ++i) {
      int first = first_of(segments[slot]);
      bool unused = left == 0 && !ending, begins = !ending && first != last;
      int k = unused ? 0 : (ending ? last : first);
      // Half a texel outwards at a span's ends. The sign tells a beginning, so u = 0 must not be.
      float u = begins ? -max(float(k), 0.25) : float(k) + (ending ? 1.0 : 0.5);
      points[i] = unused ? vec2(-FILL, 0.0) : vec2(u, depth_at(k));
      if (ending || unused) {
        ending = false;
      }
      else {
        last = last_of(segments[slot]);
        --left;
        slot = int(segments[slot] >> 20u);
        ending = left == 0 || first_of(segments[slot]) != last;
      }
    }
    imageStore(table_img, corner + ivec2(c, 0), vec4(points[0], points[1]));
  }
}

void main()
{
  int side = int(map.x), m = int(map.z);
  int j = int(gl_GlobalInvocationID.x), turn = int(gl_GlobalInvocationID.y);
  if (j >= side || turn >= int(map.y)) {
    return;
  }
  ivec2 cosine_sine = ivec2(texelFetch(turns_buf, ivec2(turn, 0), 0).xy);
  int c = cosine_sine.x, s = cosine_sine.y;
  int along = 1 - side, across = 2 * j + 1 - side;  // twice the first sample's distances from the middle
  first_sample = (side << TURN_BITS) + ivec2(along * c - across * s, along * s + across * c);
  next_sample = 2 * ivec2(c, s);
  int used = split(find_spans(side, m / 2), m);
  write(used, m, ivec2(places.zw) + ivec2(turn * ((m + 1) / 2), j));
}
