//! `labels.npz`: one int32 array `[columns][layers]` a revolution, for numpy.

use std::path::Path;

use anyhow::Result;

use super::npz::Archive;
use crate::cloud::MAX_LAYERS;
use crate::cluster::Clusters;
use crate::pipeline::Pipeline;

const NO_RETURN: i32 = 0;
const GROUND: i32 = 1;
const NOISE: i32 = 2;
const FIRST_CLUSTER: i32 = 100;

/// Writes the archive revolution by revolution.
#[derive(Debug)]
pub(super) struct LabelWriter {
    archive: Archive,
}

impl LabelWriter {
    pub(super) fn create(path: &Path) -> Result<Self> {
        let archive = Archive::create(path)?;
        Ok(Self { archive })
    }

    /// Adds the labels of the pipeline's last revolution.
    pub(super) fn put_perceived(&mut self, pipeline: &Pipeline, revolution: u32) -> Result<()> {
        let clusters = pipeline.clusters().labels().into_iter().enumerate();
        let labels = clusters.map(|(point, cluster)| label(pipeline, point, cluster));
        self.put(labels, revolution)
    }

    /// Adds an array of labels, column by column.
    pub(super) fn put(
        &mut self,
        labels: impl ExactSizeIterator<Item = i32>,
        revolution: u32,
    ) -> Result<()> {
        let shape = [labels.len() / MAX_LAYERS, MAX_LAYERS];
        self.archive
            .put(&format!("r{revolution:06}"), &shape, labels)
    }

    pub(super) fn finish(self) -> Result<()> {
        self.archive.finish()
    }
}

fn label(pipeline: &Pipeline, point: usize, cluster: u16) -> i32 {
    if !pipeline.scan().has_return(point) {
        NO_RETURN
    } else if pipeline.ground_mask()[point] {
        GROUND
    } else {
        match cluster {
            Clusters::NONE => NOISE,
            cluster => FIRST_CLUSTER + i32::from(cluster),
        }
    }
}
