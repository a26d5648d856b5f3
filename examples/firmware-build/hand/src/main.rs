//! The hand's linkages: where they come to rest.

mod sixbar {
    include!(concat!(env!("OUT_DIR"), "/sixbar.rs"));
}
mod fourbar {
    include!(concat!(env!("OUT_DIR"), "/fourbar.rs"));
}

use lamc_runtime::Error;

fn main() -> Result<(), Error> {
    let (six, _) = sixbar::Sixbar::<f64>::default().settled()?;
    let (four, _) = fourbar::Fourbar::<f64>::default().settled()?;
    println!("six-bar at {:.2?} deg", six.q.map(f64::to_degrees));
    println!("four-bar at {:.4?} deg", four.q.map(f64::to_degrees));
    Ok(())
}
