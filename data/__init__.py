"""The paper's tables; see MANIFEST.toml for sources, units and licence."""
