"""A backend of matplotlib for tests of notebooks: figures are laid out, but on no paper."""

from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image


class FigureCanvas(FigureCanvasAgg):
    """Saves pictures of one pixel; what cannot be drawn raises all the same."""

    def print_figure(self, filename, *_, format="png", **__):
        self.figure.draw_without_rendering()
        Image.new("RGB", (1, 1)).save(filename, "PNG")
