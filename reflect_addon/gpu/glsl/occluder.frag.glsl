// Depth only: what hides a reflector needs no ray.
void main()
{
}
