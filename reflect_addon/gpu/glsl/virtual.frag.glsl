// A virtual triangle in the reflection buffer. With FINISH the pixel's own ray says where it meets the real triangle, or that
// it does not: what a search got wrong, another part's image and what lies behind the silhouette are dropped here.
#include "table_lib.glsl"
#include "kernel"

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 origin = texelFetch(origin_tx, pixel, 0);
  if (abs(origin.w - frame.center.w) > 0.5) {
    discard;
    return;
  }
  vec4 direction = texelFetch(direction_tx, pixel, 0);
  mat3 map_from_world = mat3(frame.map_from_world);
  vec3 start = map_from_world * (origin.xyz - frame.center.xyz);
  vec3 along = normalize(map_from_world * direction.xyz);
  vec3 weights = v_weights;
  float tier = 0.0;
#ifdef FINISH
  // Moeller and Trumbore 1997; only triangles that face the ray.
  vec3 p = cross(along, v_edge_c);
  float facing = dot(v_edge_b, p);
  if (!(facing > 0.0)) {
    discard;
    return;
  }
  vec3 from = start - v_origin;
  vec3 q = cross(from, v_edge_b);
  weights.y = dot(from, p) / facing;
  weights.z = dot(along, q) / facing;
  float distance_along = dot(v_edge_c, q) / facing;
  weights.x = 1.0 - weights.y - weights.z;
  float width = texelFetch(normal_tx, pixel, 0).w * frame.options.x;
  if (!(distance_along > max(SLACK * width, START))) {
    discard;
    return;
  }
  if (any(lessThan(weights, vec3(0.0)))) {
    // Beside the triangle: it may fill a hole between two virtual triangles, behind whatever is met exactly.
    weights = max(weights, vec3(0.0));
    weights /= weights.x + weights.y + weights.z;
    vec3 nearest = v_origin + v_edge_b * weights.y + v_edge_c * weights.z - start;
    distance_along = dot(nearest, along);
    width += direction.w * max(distance_along, 0.0);
    // What is nearer than a few pixels is beside the ray's own start.
    if (!(length(cross(nearest, along)) <= SLACK * width) || distance_along < 8.0 * width) {
      discard;
      return;
    }
    tier = 0.5;
  }
#else
  vec3 met = v_origin + v_edge_b * weights.y + v_edge_c * weights.z;
  float distance_along = length(met - start);
#endif
  if (!(distance_along > 0.0)) {
    discard;
    return;
  }
  float far = distance_along / frame.options.x * frame.options.y;
  gl_FragDepth = 0.5 * far / (1.0 + far) + tier;
  vec4 a = texelFetch(radiance_buf, texel_of(int(v_vertices.x + 0.5)), 0);
  vec4 b = texelFetch(radiance_buf, texel_of(int(v_vertices.y + 0.5)), 0);
  vec4 c = texelFetch(radiance_buf, texel_of(int(v_vertices.z + 0.5)), 0);
  vec4 seen = a * weights.x + b * weights.y + c * weights.z;
  vec3 hit_radiance = seen.rgb;
  float hit_coverage = 1.0;
  float hit_status = STATUS_HIT;
#ifdef FINISH
  vec3 hit_position = origin.xyz + direction.xyz * (distance_along / frame.options.x);
#else
  vec3 hit_position = origin.xyz + transpose(map_from_world) * (met - start) / (frame.options.x * frame.options.x);
#endif
#ifdef MIRRORS
  mirror_out = vec4(0.0);
  if (seen.a > 0.0) {
    int row = int(texelFetch(vertices_buf, texel_of(int(v_vertices.x + 0.5)), 0).w + 0.5);
    vec3 local = texelFetch(normals_buf, texel_of(int(v_vertices.x + 0.5)), 0).xyz * weights.x +
                 texelFetch(normals_buf, texel_of(int(v_vertices.y + 0.5)), 0).xyz * weights.y +
                 texelFetch(normals_buf, texel_of(int(v_vertices.z + 0.5)), 0).xyz * weights.z;
    vec3 in_map = vec3(
        dot(texelFetch(placing_buf, ivec2(3, row), 0).xyz, local),
        dot(texelFetch(placing_buf, ivec2(4, row), 0).xyz, local),
        dot(texelFetch(placing_buf, ivec2(5, row), 0).xyz, local));
    vec3 normal = normalize(transpose(map_from_world) * in_map);
    float share = min(seen.a, 1.0);
#include "kept"
    hit_radiance *= kept_kept;
    mirror_out = vec4(normal * distance(origin.xyz, hit_position), float(1 + row) + 0.5 * share);
  }
#endif
#include "store_answer"
}
