//! What goes wrong in a stage's life, and what must come of it.
//!
//! Every test proves that its fault was really delivered, that the right cause was named, and
//! that the machine was safe afterwards; the numbers in the module names' documentation are
//! those of the fault classes.

mod bus;
mod causes;
mod cyclic;
mod cyclic_again;
mod cyclic_host;
mod detectors;
mod drive;
mod files;
mod foreign;
mod full_disk;
mod hall;
mod laser;
mod limits;
mod power;
mod scene;
mod serial;
mod start;
mod stopping;
mod storm;
mod table;
mod thermometers;
mod witness;
