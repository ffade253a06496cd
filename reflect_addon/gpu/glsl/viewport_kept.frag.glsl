// Takes a picture over before the next one is drawn in its place.
void main()
{
  color_out = texelFetch(drawn_tx, ivec2(gl_FragCoord.xy), 0);
}
