#version 330 core
// Draws the shadow map: depth only.
void main() {}
