// Provides of_mirror(origin, normal): whether a ray map's pixel shows a planar mirror.
// plane_origin: a point of the mirror's plane, w = how far from it the mirror may be, m; plane_normal: w = the reflector's index.
bool of_mirror(vec4 origin, vec3 normal)
{
  return abs(origin.w - plane_normal.w) <= 0.5 && abs(dot(origin.xyz - plane_origin.xyz, plane_normal.xyz)) <= plane_origin.w &&
         dot(normal, plane_normal.xyz) >= 0.999;
}
