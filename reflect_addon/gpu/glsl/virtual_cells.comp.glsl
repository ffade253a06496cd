// How far the cells of one level of a grid err: pixels from where the middle is to where its corners say it is. 0 where the cell
// above errs little, ALWAYS where a corner was not found.
// range: x first, y count of the cells; view: xy pixels of the picture, z the error that is allowed, px.
#include "table_lib.glsl"

vec2 pixel_of(vec3 virtual_P)
{
  vec4 clip = clip_from_map * vec4(virtual_P, 1.0);
  return clip.xy / max(clip.w, 1e-20) * 0.5 * view.xy;
}

void main()
{
  int index = int(gl_GlobalInvocationID.y) * COLUMNS + int(gl_GlobalInvocationID.x);
  if (index >= int(range.y)) {
    return;
  }
  index += int(range.x);
  vec4 more = texelFetch(cells_buf, texel_of(3 * index + 2), 0);  // middle, cell above
  float error = 0.0;
  if (more.y < -0.5 || imageLoad(errors_img, texel_of(int(more.y + 0.5))).x > view.z) {
    vec3 mean = vec3(0.0);
    for (int corner = 0; corner < 8; corner++) {
      vec4 found = imageLoad(
          virtual_img, texel_of(int(texelFetch(cells_buf, texel_of(3 * index + corner / 4), 0)[corner % 4] + 0.5)));
      mean += 0.125 * found.xyz;
      error = (found.w > FAILED - 0.5) ? ALWAYS : error;
    }
    if (more.x > -0.5 && error == 0.0) {
      vec4 middle = imageLoad(virtual_img, texel_of(int(more.x + 0.5)));
      error = (middle.w > FAILED - 0.5) ? ALWAYS : distance(pixel_of(middle.xyz), pixel_of(mean));
    }
  }
  imageStore(errors_img, texel_of(index), vec4(error));
}
