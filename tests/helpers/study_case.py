"""A small case with a study of three curves."""

from helpers.cases import oscillator

CASE = oscillator(
    head='title = "oscillator"\nharmonics = "0..3"\n',
    rubbing="velocity = 10.0",
    response='from = 5.0\nto = 7.0\nfirst_step = 0.05\nmax_step = 0.05\n[study]\n"damper.velocity" = [20, 30, 40]\n',
)
