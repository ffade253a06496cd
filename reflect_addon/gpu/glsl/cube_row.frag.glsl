// A cube face among the six of level 0, as core/cubemap.py stores it. corner: px of the face in the row; distances are stored over `scale`.
void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy - corner.xy);
  float far = texelFetch(distance_tx, pixel, 0).r;
  texel_out = vec4(texelFetch(radiance_tx, pixel, 0).rgb, (far < 0.5 * FAR) ? far / scale : 0.0);
}
