// One triangle that covers the screen for each lamp. corner: xy its place in clip space, z the lamp's row.
void main()
{
  v_lamp = corner.z;
  gl_Position = vec4(corner.xy, 0.0, 1.0);
}
