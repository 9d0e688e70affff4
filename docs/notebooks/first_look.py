# %% [markdown]
# # First look
#
# One case is one scene with parameters on one engine, with one profile (set of settings) and one step. A ball falls
# and rebounds with restitution 0.7, on MuJoCo as shipped:

# %%
import contact_crosscheck as cc

shipped = cc.run("bounce", engine="mujoco", e=0.7, dimension=3)
shipped

# %% [markdown]
# A table of checks appears: what was measured, the truth, the tolerance and the verdict. Why does the ball not rebound,
# and what fixes it?

# %%
print(shipped.explain())

# %% [markdown]
# The same case with the best stock settings for the scene:

# %%
tuned = cc.run("bounce", engine="mujoco", profile="tuned", e=0.7, dimension=3)
tuned.plot("z")

# %% [markdown]
# Positions, velocities and contacts over time are arrays:

# %%
motion = tuned.trajectory
height = motion.pose[:, 1, 2]  # samples, bodies (floor, ball), x y z and quaternion
print(f"{len(motion.t)} samples of {motion.dt:.4f} s, the ball ends at {height[-1]:.3f} m")

# %% [markdown]
# Each check of each case is a row of a table. Which restitution does each engine realise?

# %%
found = cc.sweep("bounce", engine=["mujoco", "chipmunk"], dimension=2, e=[0.3, 0.5, 0.7, 0.9], height=2.0)
found["off"] = (found.error / found.tolerance).abs()
found[found.metric == "apex[1]"].pivot_table(index="param.e", columns="engine", values="off")

# %% [markdown]
# Values above 1 are beyond the tolerance. What else there is:

# %%
cc.scenes()[["name", "title", "law"]].head()

# %%
installed = cc.engines().query("status == 'installed'")
installed[["name", "version", "profiles"]]
