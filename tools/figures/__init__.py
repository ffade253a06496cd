"""The pictures of popescu-2006 made by what was built, Cycles' truth beside them: `./dev figures`.

A figure is one function of a Studio (studio.py) that returns a Figure; FIGURES in __main__.py lists them. What all share:
a scene with its rays, truth and bakes (shot.py), labelled pictures side by side (sheet.py), the index (page.py).
"""
