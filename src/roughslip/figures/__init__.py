"""Figures and their common style. DRAWN names, by figure, the variables of a result that it draws and stores."""
