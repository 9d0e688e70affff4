# %% [markdown]
# # My model and my paper's figure
#
# A model that you have (MJCF, URDF or SDF with free bodies) runs on every engine. Here a ball drops onto a box that
# stands on the floor:

# %%
from pathlib import Path

import altair as alt
import pandas as pd

import contact_crosscheck as cc

Path("drop.xml").write_text("""
<mujoco model="drop">
  <option timestep="0.002"/>
  <worldbody>
    <geom name="floor" type="plane" size="2 2 .1"/>
    <body name="box" pos="0 0 .2"><freejoint/><geom type="box" size=".3 .3 .2" mass="2"/></body>
    <body name="ball" pos="0 0 .9"><freejoint/><geom type="sphere" size=".1" mass=".2"/></body>
  </worldbody>
</mujoco>
""")
scene = cc.Scene.from_mjcf("drop.xml")
print(scene.title, scene.dimensions)
scene.notes

# %% [markdown]
# On MuJoCo it runs as its author made it; on the others its contacts are rigid. The reference solver certifies its
# answer, so that it stands for the truth that a model does not state.

# %%
results = {
    "MuJoCo, as modelled": cc.run(scene, engine="mujoco", dimension=2, duration=1.0),
    "Chipmunk, tuned": cc.run(scene, engine="chipmunk", profile="tuned", dimension=2, duration=1.0),
    "reference": cc.run(scene, engine="reference", dimension=2, duration=1.0),
}
results["reference"].observation.certificate["certified"]

# %% [markdown]
# ## The figure
#
# Height of the ball's centre against time. The chart is written as PDF without a browser.

# %%
curves = pd.concat(
    pd.DataFrame(
        {"t": result.trajectory.t, "height": result.trajectory.pose[:, result.bodies.index("ball"), 1], "engine": name}
    )
    for name, result in results.items()
)
figure = (
    alt.Chart(curves)
    .mark_line()
    .encode(
        x=alt.X("t").title("time [s]"),
        y=alt.Y("height").title("height of the ball [m]").scale(zero=False),
        color=alt.Color("engine").title(None),
    )
    .properties(width=320, height=200)
)
figure.save("figure.pdf")
figure

# %% [markdown]
# ## The table
#
# How far the bodies overlap, and whether the model's energy grows:

# %%
table = pd.concat(result.frame().assign(case=name) for name, result in results.items())
table = table[table.metric.isin(["penetration", "energy_growth"])].pivot(index="case", columns="metric", values="value")
table.to_csv("table.csv")
table

# %% [markdown]
# ## What to cite
#
# Versions and commit stand with the results:

# %%
results["reference"].frame().attrs
