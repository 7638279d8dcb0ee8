"""Pictures of train_derail's results, made for print and readable without colour."""
