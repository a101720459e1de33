"""What users build with: structures from meshes with contacts on a surface, and the parametric blade."""
